"""Rooks in German: what its panels, tooltips and status lines say. Warnings and errors are in English.

Another language is another dictionary. What there is to be translated stands in `iface_`, `rpt_` and `n_`, which are
Blender's own functions by the names that its tools for translators know, and in the properties. A text that Blender
itself has a translation of gets that one.
"""

from __future__ import annotations

import bpy

from .progress import SAMPLERS_CONTEXT

_PANELS = {
    "Rooks Presets": "Rooks-Vorgaben",
    "Even in 2-D": "Gleichmäßig in 2D",
    "Even in 1-D": "Gleichmäßig in 1D",
    "Irregular": "Unregelmäßig",
    "pixel": "Pixel",
    "lens": "Linse",
    "light": "Licht",
    "surface": "Oberfläche",
    "1 point": "1 Punkt",
    "{count} points": "{count} Punkte",
    "{count} points; shown: a set of {shown}": "{count} Punkte; gezeigt: ein Satz von {shown}",
    "1 sample per pixel": "1 Abtastwert pro Pixel",
    "{count} samples per pixel": "{count} Abtastwerte pro Pixel",
    "{count} asked for": "{count} verlangt",
    "{sampler} takes {count} samples": "{sampler} nimmt {count} Abtastwerte",
    "Together they take {count} samples": "Zusammen nehmen sie {count} Abtastwerte",
    "In the viewport: {count} samples": "In der Ansicht: {count} Abtastwerte",
}
_STATUS = {
    "Reading the scene": "Szene wird gelesen",
    "Loading the renderer": "Renderer wird geladen",
    "Preparing the scene": "Szene wird vorbereitet",
    "Compiling kernels, first render only: {share:.0%}": "Kernel werden übersetzt, nur beim ersten Mal: {share:.0%}",
    "{megabytes:.0f} MB": "{megabytes:.0f} MB",
    "{done} of {total} tiles": "{done} von {total} Kacheln",
    "{done} of {total} samples": "{done} von {total} Abtastwerten",
    "{millions:.1f} million samples/s": "{millions:.1f} Millionen Abtastwerte/s",
    "{time} left": "noch {time}",
    "stopped": "abgebrochen",
    "stopped at {share:.0%}": "abgebrochen bei {share:.0%}",
    "stopping": "wird abgebrochen",
    "Last render: {setup:.1f} s to set up, {trace:.1f} s to trace": (
        "Letztes Bild: {setup:.1f} s Vorbereitung, {trace:.1f} s Rendern"
    ),
    "Memory: {megabytes:.0f} MB and the picture's own": "Speicher: {megabytes:.0f} MB und der des Bildes",
    "Comparing samplers: {progress} (Esc: cancel)": "Sampler werden verglichen: {progress} (Esc: abbrechen)",
    "Comparing samplers was cancelled": "Der Vergleich der Sampler wurde abgebrochen",
    "Samplers are being compared": "Sampler werden gerade verglichen",
}
_SETTINGS = {
    "Samples per pixel. A sampler that cannot make this count takes the next one above that it can. Textures finer "
    "than the pixels need more of them with any sampler": (
        "Abtastwerte pro Pixel. Ein Sampler, der diese Anzahl nicht bilden kann, nimmt die nächsthöhere, die er kann. "
        "Texturen, die feiner als die Pixel sind, brauchen mit jedem Sampler mehr davon"
    ),
    "Viewport Samples": "Abtastwerte der Ansicht",
    "Samples per pixel in the rendered viewport, which takes them one after the other. At the same count as for "
    "renders it ends with the same picture": (
        "Abtastwerte pro Pixel in der gerenderten Ansicht, die sie nacheinander nimmt. Bei gleicher Anzahl wie beim "
        "Rendern endet sie mit demselben Bild"
    ),
    "Separate Samplers": "Getrennte Sampler",
    "Choose a technique for each domain: the pixel, the lens, the lights and the surfaces": (
        "Je ein Verfahren für Pixel, Linse, Lichter und Oberflächen wählen"
    ),
    "Another seed gives another, independent noise pattern": (
        "Ein anderer Startwert gibt ein anderes, unabhängiges Rauschmuster"
    ),
    "Animate Seed": "Startwert animieren",
    "Give each frame of an animation a noise pattern of its own": (
        "Jedem Einzelbild einer Animation ein eigenes Rauschmuster geben"
    ),
    "The side of the squares in which a picture is rendered and shown. It changes nothing in the picture: small tiles "
    "appear sooner, and keep all threads busy to the end": (
        "Die Seite der Quadrate, in denen ein Bild gerendert und gezeigt wird. Am Bild ändert sie nichts: kleine "
        "Kacheln erscheinen früher und beschäftigen alle Threads bis zum Schluss"
    ),
    "How often light may be reflected or let through on its way, in all. 0 is direct light only": (
        "Wie oft Licht auf seinem Weg insgesamt reflektiert oder durchgelassen werden darf. 0 ist nur direktes Licht"
    ),
    "How often light may be reflected diffusely, within the total of Max Bounces": (
        "Wie oft Licht diffus reflektiert werden darf, innerhalb der Gesamtzahl"
    ),
    "How often light may be reflected by glossy surfaces, within the total of Max Bounces": (
        "Wie oft Licht von glänzenden Oberflächen reflektiert werden darf, innerhalb der Gesamtzahl"
    ),
    "How often light may go through glass and the like, within the total of Max Bounces": (
        "Wie oft Licht durch Glas und Ähnliches gehen darf, innerhalb der Gesamtzahl"
    ),
    "Transparent Bounces": "Transparente Flächen",
    "How many transparent surfaces light may pass straight on. They do not count for Max Bounces": (
        "Wie viele transparente Flächen Licht geradeaus durchqueren darf. Sie zählen nicht zur Gesamtzahl"
    ),
    "Clamp Indirect": "Indirektes begrenzen",
    "The most that a single sample of bounced light may add; what is above it is cut off. Fewer fireflies, but a bias: "
    "the picture gets darker than it should be, whatever the number of samples. A larger lamp makes fewer without one. "
    "0 is off": (
        "Wie viel ein einzelner Abtastwert reflektierten Lichts höchstens beitragen darf; was darüber liegt, wird "
        "abgeschnitten. Weniger Glühpunkte, aber eine Verfälschung: das Bild wird dunkler, als es sein soll, bei jeder "
        "Anzahl von Abtastwerten. Eine größere Lampe macht weniger ohne sie. 0 ist aus"
    ),
    "Pixel Filter": "Pixelfilter",
    "How the samples around a pixel add up to it": "Wie die Abtastwerte um ein Pixel sich zu ihm summieren",
    "The mean over the pixel's own square": "Der Mittelwert über das Quadrat des Pixels",
    "A smooth bell of the chosen width: softer, without stair steps": (
        "Eine glatte Glocke der gewählten Breite: weicher, ohne Treppenstufen"
    ),
    "Sampling Error": "Abtastfehler",
    "The standard error of each pixel's mean, estimated from its samples": (
        "Der Standardfehler des Mittelwerts jedes Pixels, geschätzt aus seinen Abtastwerten"
    ),
    "Normal and albedo of what the camera sees, for the compositor's Denoise node": (
        "Normale und Albedo dessen, was die Kamera sieht, für den Entrauschen-Node des Compositors"
    ),
    "Glossy Lobe": "Glanzkeule",
    "How the material's Glossy BSDF nodes scatter light": "Wie die Glanz-BSDF-Knoten des Materials Licht streuen",
    "Microfacet": "Mikrofacetten",
    "By the distribution that each node chooses, as in Cycles": (
        "Nach der Verteilung, die jeder Knoten wählt, wie in Cycles"
    ),
    "Cosine Power": "Kosinuspotenz",
    "Replaces the lobe of the material's Glossy BSDF nodes by the textbook's (Suffern, Ray Tracing from the Ground Up, "
    "ch. 25): a power of the cosine about the mirror direction": (
        "Ersetzt die Keule der Glanz-BSDF-Knoten des Materials durch die des Lehrbuchs (Suffern, Ray Tracing from the "
        "Ground Up, Kap. 25): eine Potenz des Kosinus um die Spiegelrichtung"
    ),
}
_COMPARISON = {
    "Compare Samplers": "Sampler vergleichen",
    "Numbers of samples per pixel, such as: 4 16 64. A sampler that cannot make one of them takes the next one above "
    "that it can": (
        "Anzahlen von Abtastwerten pro Pixel, etwa: 4 16 64. Ein Sampler, der eine davon nicht bilden kann, nimmt die "
        "nächsthöhere, die er kann"
    ),
    "Seeds": "Startwerte",
    "How many noise patterns of each are measured: more make the measured error more certain": (
        "Wie viele Rauschmuster von jedem gemessen werden: mehr machen den gemessenen Fehler sicherer"
    ),
    "Longer Side": "Längere Seite",
    "Pictures with a longer side than this are measured at this size": (
        "Bilder mit einer längeren Seite als dieser werden in dieser Größe gemessen"
    ),
    "Folder": "Ordner",
    "Where the sheet, the chart and the tables are saved. Empty: the folder for temporary files": (
        "Wo Übersicht, Diagramm und Tabellen gespeichert werden. Leer: der Ordner für temporäre Dateien"
    ),
    "Measure the error and the time of several samplers on this scene, and recommend one": (
        "Fehler und Zeit mehrerer Sampler an dieser Szene messen und einen empfehlen"
    ),
    "Stop comparing samplers; nothing is saved": "Den Vergleich der Sampler abbrechen; nichts wird gespeichert",
    "Add Rooks Preset": "Rooks-Vorgabe hinzufügen",
    "Keep the sampling, the light paths and the pixel filter as a preset, or remove a preset of one's own": (
        "Abtastung, Lichtpfade und Pixelfilter als Vorgabe behalten oder eine eigene Vorgabe entfernen"
    ),
}
#: The names of the samplers and of what they place have a context of their own: Blender has other words for "Regular".
_SAMPLERS = {
    "Samplers": "Sampler",
    "The samplers to compare": "Die Sampler, die verglichen werden",
    "Sampler": "Sampler",
    "The technique that places the samples of every domain": (
        "Das Verfahren, das die Abtastwerte aller Bereiche verteilt"
    ),
    "Pixel": "Pixel",
    "Places the camera rays on the area of a pixel: antialiasing": (
        "Verteilt die Kamerastrahlen auf die Fläche eines Pixels: Kantenglättung"
    ),
    "Lens": "Linse",
    "Places the camera rays on the lens: depth of field": "Verteilt die Kamerastrahlen auf die Linse: Tiefenschärfe",
    "Light": "Licht",
    "Places the shadow rays on the lights: soft shadows": (
        "Verteilt die Schattenstrahlen auf die Lichter: weiche Schatten"
    ),
    "Surface": "Oberfläche",
    "Places the directions in which surfaces look for the world, glowing meshes and bounced light": (
        "Verteilt die Richtungen, in denen Oberflächen nach der Welt, leuchtenden Netzen und reflektiertem Licht suchen"
    ),
    "Regular": "Regelmäßig",
    "The centres of a regular grid, the same in every pixel and frame. Even and free of noise, but fine detail turns "
    "into moiré, near-vertical edges into steps, and soft shadows and blur into bands and copies. For all but "
    "comparison take Jittered": (
        "Die Mitten eines regelmäßigen Gitters, in jedem Pixel und Bild dieselben. Gleichmäßig und rauschfrei, aber "
        "feine Details werden zu Moiré, fast senkrechte Kanten zu Stufen, weiche Schatten und Unschärfe zu Streifen "
        "und Doppelbildern. Außer zum Vergleich besser „Verwackelt“"
    ),
    "Random": "Zufällig",
    "Independent random points. Never aliases, but clumps and gaps make it the noisiest of all. Take Multi-Jittered "
    "for less noise at any count": (
        "Unabhängige Zufallspunkte. Nie Aliasing, aber Klumpen und Lücken machen das stärkste Rauschen von allen. Bei "
        "jeder Anzahl rauscht „Mehrfach verwackelt“ weniger"
    ),
    "Jittered": "Verwackelt",
    "One random point in each cell of a grid. Even over the square and a good choice for any picture, but uneven along "
    "each axis, which shows on edges close to horizontal or vertical. There take Multi-Jittered": (
        "Ein Zufallspunkt in jeder Zelle eines Gitters. Gleichmäßig über das Quadrat und gut für jedes Bild, aber "
        "ungleichmäßig auf jeder Achse, was an fast waagrechten oder senkrechten Kanten zu sehen ist. Dort besser "
        "„Mehrfach verwackelt“"
    ),
    "N-Rooks": "N Türme",
    "One point in each row and each column of a fine grid. Perfectly even along each axis, good for horizontal and "
    "vertical edges, but little better than random over the square. For all else take Multi-Jittered": (
        "Ein Punkt in jeder Zeile und jeder Spalte eines feinen Gitters. Auf jeder Achse vollkommen gleichmäßig, gut "
        "für waagrechte und senkrechte Kanten, aber über das Quadrat kaum besser als Zufall. Für alles andere besser "
        "„Mehrfach verwackelt“"
    ),
    "Multi-Jittered": "Mehrfach verwackelt",
    "One point in each cell of a coarse grid and in each row and column of a fine one. Even over the square and along "
    "each axis: the best all-rounder, though points can still come close to each other. At powers of two Sobol has "
    "less noise in smooth light": (
        "Ein Punkt in jeder Zelle eines groben Gitters und in jeder Zeile und Spalte eines feinen. Gleichmäßig über "
        "das Quadrat und auf jeder Achse: der beste Alleskönner, auch wenn Punkte einander noch nahe kommen können. "
        "Bei Zweierpotenzen rauscht Sobol in glattem Licht weniger"
    ),
    "Hammersley": "Hammersley",
    "Equal steps in x, mirrored binary digits in y. Even over the square and along each axis, but the same in every "
    "pixel and frame: moiré, bands and copies in place of noise, and a picture that is shifted, by half a pixel with "
    "one sample. Take Sobol instead": (
        "Gleiche Schritte in x, gespiegelte Binärziffern in y. Gleichmäßig über das Quadrat und auf jeder Achse, aber "
        "in jedem Pixel und Bild dieselben Punkte: Moiré, Streifen und Doppelbilder statt Rauschen, und ein "
        "verschobenes Bild, mit einem Abtastwert um ein halbes Pixel. Besser Sobol"
    ),
    "Sobol, Owen-Scrambled": "Sobol, nach Owen gemischt",
    "Stratified on grids of every shape at once, at random within. The least error where the picture is smooth, and "
    "good everywhere; best at powers of two. At other counts take Multi-Jittered": (
        "Auf Gittern jeder Form zugleich geschichtet, darin zufällig. Der kleinste Fehler, wo das Bild glatt ist, und "
        "gut überall; am besten bei Zweierpotenzen. Bei anderen Anzahlen besser „Mehrfach verwackelt“"
    ),
    "Correlated Multi-Jittered": "Korreliert mehrfach verwackelt",
    "Multi-jittered with one shuffle shared by all rows and one by all columns, which keeps the points further apart. "
    "As good on edges as Sobol, at any count. Detail as fine as its points makes more noise: there take "
    "Multi-Jittered": (
        "Mehrfach verwackelt, mit einer Mischung für alle Zeilen und einer für alle Spalten, was die Punkte weiter "
        "auseinander hält. An Kanten so gut wie Sobol, bei jeder Anzahl. Details, so fein wie seine Punkte, rauschen "
        "mehr: dort besser „Mehrfach verwackelt“"
    ),
    "ZSobol": "ZSobol",
    "One Sobol sequence for the whole picture, shared out along a Z-curve. The same error as Sobol, but spread as "
    "fine, even grain that the eye averages away. Powers of two only: for other counts take Multi-Jittered": (
        "Eine Sobol-Folge für das ganze Bild, verteilt entlang einer Z-Kurve. Derselbe Fehler wie bei Sobol, aber als "
        "feines, gleichmäßiges Korn, über das das Auge mittelt. Nur Zweierpotenzen: für andere Anzahlen „Mehrfach "
        "verwackelt“"
    ),
    "Fibonacci": "Fibonacci",
    "A lattice turned by the golden ratio and shifted at random. Even over the square and along each axis, and at most "
    "counts its points keep apart, but it is regular: where fine detail meets its spacing, all points agree, and the "
    "noise is that of one. There take Multi-Jittered": (
        "Ein Gitter, nach dem Goldenen Schnitt gedreht und zufällig verschoben. Gleichmäßig über das Quadrat und auf "
        "jeder Achse, und bei den meisten Anzahlen halten die Punkte Abstand, aber es ist regelmäßig: wo feine Details "
        "seinen Abstand treffen, sind alle Punkte gleich, und es rauscht wie mit einem. Dort besser „Mehrfach "
        "verwackelt“"
    ),
}

#: By text, without contexts.
GERMAN = _PANELS | _STATUS | _SETTINGS | _COMPARISON | _SAMPLERS


def register() -> None:
    contexts = bpy.app.translations.contexts
    german = {(contexts.default, text): translated for text, translated in GERMAN.items()}
    german |= {(contexts.operator_default, text): translated for text, translated in _COMPARISON.items()}
    german |= {(SAMPLERS_CONTEXT, text): translated for text, translated in _SAMPLERS.items()}
    bpy.app.translations.register(__package__, {"de": german})


def unregister() -> None:
    bpy.app.translations.unregister(__package__)

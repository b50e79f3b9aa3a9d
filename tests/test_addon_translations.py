"""All that Rooks says in Blender can be translated, and all that can be set explains itself."""

from __future__ import annotations

import ast
import string
from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy")

import core  # noqa: E402
from addon import compare_operators, engine, failures, kernels, progress, properties, translations, ui  # noqa: E402
from addon.viewport_session import Picture, Session  # noqa: E402
from tests.addon_helpers import empty_scene, export, lamp, quad, shader  # noqa: E402
from tests.translation_helpers import (  # noqa: E402
    SOURCES,
    described_parts,
    into_brackets,
    messages,
    speak,
    untranslated,
)

#: What the command line says, also where there is no Blender to translate it.
OF_THE_COMMAND_LINE = {
    *("blend_files", "cli", "comparing", "console", "headless", "headless_compare", "outputs", "scene_options"),
}


@pytest.fixture
def translate(monkeypatch):
    """A language with brackets around what has a translation, in which the add-on speaks."""
    translate = into_brackets()
    speak(monkeypatch, translate)
    return translate


class Layout:
    """Notes what a panel shows, translated as Blender's layout does it, which is there in a window only."""

    def __init__(self, translate) -> None:
        self.texts: list[str] = []
        self._translate = translate

    def label(self, text: str = "", translate: bool = True, **_options) -> None:
        self.texts.append(self._translate(text) if translate else text)

    progress = label

    def prop(self, owner, name: str, text: str | None = None, **_options) -> None:
        # Others are Blender's, and translated by it.
        if text is not None or isinstance(owner, properties.CLASSES):
            self.label(owner.bl_rna.properties[name].name if text is None else text)

    def operator(self, name: str, text: str | None = None, **_options) -> None:
        if text is None:
            text = getattr(bpy.ops.rooks, name.partition(".")[2]).get_rna_type().name
        self.label(text)

    def __getattr__(self, name: str):
        return lambda *_arguments, **_options: self


def everything() -> SimpleNamespace:
    """A context in which all panels have something to show."""
    scene = empty_scene()
    rooks = scene.rooks
    rooks.use_separate_samplers, rooks.samples, rooks.pixel_filter = True, 17, "BLACKMAN_HARRIS"
    rooks.pixel_sampler, rooks.lens_sampler = "RANDOM", "JITTERED"
    paint, _node = shader("ShaderNodeBsdfDiffuse")
    paint.node_tree.nodes.clear()
    return SimpleNamespace(
        engine="ROOKS",
        scene=scene,
        view_layer=scene.view_layers[0],
        object=quad(),
        material=paint,
        world=bpy.data.worlds.new("World"),
        light=lamp("POINT").data,
    )


@pytest.mark.parametrize("panel", ui.CLASSES)
def test_what_panels_show_is_translated(panel, translate, monkeypatch):
    context = everything()
    film = core.Film(0, 0, 100, 50, 16, (100, 50), finished_pixels=5, seconds=0.5, setup_seconds=0.25)
    film.cancelled = True
    monkeypatch.setattr(engine, "last_render", progress.finished_lines(film))
    worker = SimpleNamespace(share=0.25, doing="Loading the renderer", is_cancelled=False)
    for running in (None, worker):
        monkeypatch.setattr(compare_operators, "running", lambda running=running: running)
        for samples in (17, 256):
            context.scene.rooks.samples = samples
            layout = Layout(translate)
            assert panel.poll(context)
            panel.draw(SimpleNamespace(layout=layout, column=lambda layout=layout: layout), context)
            assert {text: words for text in layout.texts if (words := untranslated(text))} == {}
    assert untranslated(translate(panel.bl_label)) == []


def test_status_lines_are_translated(translate):
    film = core.Film(0, 0, 100, 50, 16, (100, 50), finished_pixels=5000, seconds=0.5, setup_seconds=0.25)
    texts = [kernels.progress_text(0.5), progress.speed_text(2e6), *progress.finished_lines(film)]
    for options in ({"samples": 1, "sampler": "random"}, {"samples": 17, "lens_sampler": "jittered"}):
        told = progress.Progress(core.RenderSettings(**options))
        texts += [told.text, told.finished(film)]
        for done in (1, 2, 3):
            told.add(core.Tile(0, 0, 64, 64, {}, done, 9, 12_300_000))
            texts.append(told.text)
    for is_cancelled in (False, True):
        worker = SimpleNamespace(share=0.25, doing="Loading the renderer", is_cancelled=is_cancelled)
        texts.append(compare_operators.progress_text(worker))
    session = SimpleNamespace(error=None, activity="", picture=Picture(None, 0, 0, 1, 3, 16, ()))
    texts.append(Session.text.fget(session))
    assert {text: words for text in texts if (words := untranslated(text))} == {}


def test_warnings_and_errors_are_translated(translate):
    empty_scene()
    bpy.context.scene.render.use_motion_blur = True
    paint, node = shader("ShaderNodeBsdfGlossy", "1", Anisotropy=0.5)
    node.name, node.distribution = "2", "ASHIKHMIN_SHIRLEY"
    quad("3").data.materials.append(paint)
    lamp("AREA", name="4", size=1).data.spread = 1.0
    _scene, warnings = export()
    assert len(warnings) == 3
    texts = [*warnings, failures.failure_text(MemoryError()), failures.failure_text(ImportError("5"))]
    kept = {"GGX", "Anisotropy", "Ashikhmin", "Shirley"}
    assert {text: words for text in texts if (words := set(untranslated(text)) - kept)} == {}


@pytest.mark.parametrize(
    "source", [path for path in SOURCES if path.stem not in OF_THE_COMMAND_LINE], ids=lambda p: p.stem
)
def test_no_sentence_is_an_f_string(source):
    """It would be put together before anybody could look for its translation."""
    for node in ast.walk(ast.parse(source.read_text())):
        if isinstance(node, ast.JoinedStr):
            parts = [part.value for part in node.values if isinstance(part, ast.Constant)]
            words = [word for part in parts for word in part.split() if word.isalpha() and " " in part]
            assert words == [], f"{source.name}:{node.lineno}"


def test_what_is_translated_is_there_and_has_the_same_gaps():
    assert translations.GERMAN.keys() - messages() == set()

    def gaps(text: str) -> list:
        return sorted(field[1:3] for field in string.Formatter().parse(text) if field[1] is not None)

    assert {text for text, german in translations.GERMAN.items() if gaps(text) != gaps(german)} == set()


def test_everything_that_can_be_set_or_done_has_a_tooltip_as_blender_writes_them():
    for described in described_parts():
        assert described.name, described
        assert described.description, described
        assert not described.description.endswith("."), described.description

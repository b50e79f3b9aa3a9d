"""What translators get to see of Rooks, and a language in which they have translated all of it."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import bpy

from addon import compare_operators, presets, properties

SOURCES = sorted((Path(__file__).parents[1] / "addon").glob("*.py"))
CLASSES = (*properties.CLASSES, *compare_operators.CLASSES, presets.ROOKS_OT_preset_add)

#: Calls whose argument of this number Blender's tools for translators collect, and `text=` of any call.
COLLECTED = {"iface_": 0, "rpt_": 0, "n_": 0, "poll_message_set": 0, "report": 1}


def messages() -> set[str]:
    """All that there is to be translated: marked in the sources as Blender wants it, or said of the classes."""
    return {text for text in (*in_sources(), *in_classes()) if text}


def in_sources() -> Iterator[str]:
    for source in SOURCES:
        for node in ast.walk(ast.parse(source.read_text())):
            if isinstance(node, ast.Call):
                name = getattr(node.func, "id", getattr(node.func, "attr", ""))
                place = COLLECTED.get(name, len(node.args))
                yield from literals(*node.args[place : place + 1])
                yield from literals(*(keyword.value for keyword in node.keywords if keyword.arg == "text"))
            if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "bl_label":
                yield from literals(node.value)


def literals(*nodes: ast.AST) -> Iterator[str]:
    return (node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str))


def in_classes() -> Iterator[str]:
    for described in described_parts():
        yield described.name
        yield described.description


def described_parts() -> Iterator[bpy.types.bpy_struct]:
    """Operators, and properties with the items that they choose from."""
    for cls in CLASSES:
        is_operator = issubclass(cls, bpy.types.Operator)
        rna = getattr(bpy.ops.rooks, cls.bl_idname.partition(".")[2]).get_rna_type() if is_operator else cls.bl_rna
        if is_operator:
            yield rna
        for prop in rna.properties:
            if prop.identifier not in ("rna_type", "name") and not prop.is_hidden:
                yield prop
                yield from getattr(prop, "enum_items_static", ())
    for owner in (bpy.types.Scene, bpy.types.ViewLayer, bpy.types.Material):
        yield owner.bl_rna.properties["rooks"]


def into_brackets() -> Callable[..., str]:
    """A translator into a language that has brackets around what was translated, once for each time."""
    known = messages()
    return lambda text, _context=None: f"«{text}»" if text in known else text


def speak(monkeypatch, translate: Callable[..., str]) -> None:
    """Make the add-on's modules speak a language: Blender's Python module has none but English."""
    for name, module in list(sys.modules.items()):
        for function in ("iface_", "rpt_"):
            if name.startswith("addon.") and hasattr(module, function):
                monkeypatch.setattr(module, function, translate)


def untranslated(text: str) -> list[str]:
    """The words of a text that stand in no brackets."""
    before = None
    while before != text:
        before, text = text, re.sub(r"«[^«»]*»", "", text)
    return re.findall(r"[^\W\d_]{2,}", text)

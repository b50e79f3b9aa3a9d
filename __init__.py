"""Rooks as a Blender extension: Blender imports this file when the extension is enabled.

The add-on is imported inside the functions, so that this repository can be imported where there is no Blender.
"""


def register() -> None:
    """Make Rooks known to Blender."""
    from . import addon

    addon.register()


def unregister() -> None:
    """Take Rooks out of Blender again."""
    from . import addon

    addon.unregister()

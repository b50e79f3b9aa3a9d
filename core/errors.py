"""Errors that a user can cause and mend. A bug is an assertion instead."""


class RooksError(Exception):
    """Base of all errors whose text is meant for the user: one line that names the thing and says what to do."""


class SceneError(RooksError):
    """The scene cannot be rendered: the text names the object and what is wrong with it."""


class SettingsError(RooksError):
    """A setting is out of its range or names something unknown."""


class OutputError(RooksError):
    """A picture cannot be written."""

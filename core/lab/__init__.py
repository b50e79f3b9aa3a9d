"""The sampling lab: what a sampling technique does, as pictures, scores and charts. `python -m core --help` lists it.

Rendering needs nothing of it. Its modules are loaded by name when a command asks for them, since they import
matplotlib and scipy, which are not there wherever the renderer is.
"""

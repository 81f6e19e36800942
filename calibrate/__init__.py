"""Fits of a performer's parameters to records, and what the records can tell about them.

Importing this room is light; simulators are loaded by the first run.
"""

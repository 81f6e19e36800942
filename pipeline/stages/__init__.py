"""Stages: each a pure function from inputs to an output file, with a thin command line around it."""

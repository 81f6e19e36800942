"""Benchmarks: every module without a leading underscore has ``rows()``, and asserts nothing.

A row is a dict with the keys ``name``, ``value``, ``unit``, ``peer``, ``peer_value``, ``ratio``, ``goal``; None or ""
where there is nothing to say.  ``goal`` reads ``< 1.5`` or ``>= 5`` and is about the ratio where there is
one and about the value elsewhere, unless it says so: ``value < 2``.
"""

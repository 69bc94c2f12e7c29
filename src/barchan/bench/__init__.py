"""Benchmarks: barchan beside every other DEM code found on this machine, on the same grains, in one run.

``cases`` says what is simulated, ``peers`` how a code is driven, ``comparison`` how it is measured, ``results`` what is told;
``benchmark.run`` does all of it. Every code lives in a process of its own (``process``, ``drivers``, ``serving``) and sleeps
while another one is timed.
"""

# SPDX-License-Identifier: MIT
"""Reads a Stirpoint run directory and draws it.

run      the run directory: frames, series, histories, input text
needs    the packages that the scripts need
table    CSV histories by column name and unit
raster   particles to pixels: top view, section, the nearest to a viewer
look     colours, fonts, names and units for people
maps     top views and sections of a field
surface  the deformed plate, lit, seen from above
curves   thermocouples, tool loads, energies
tools    where the tools are, and the phases of their way
metal    what hangs together: flash, debris, groove
summary  the key figures and the phases
alarms   what to be wary of
page     one self-contained HTML page
cli      the command line
"""

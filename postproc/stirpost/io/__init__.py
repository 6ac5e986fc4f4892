# SPDX-License-Identifier: MIT
"""Files in and out: run directories, frames, tables, inputs, meshes, the solver."""

"""Compilation of C code at run time: compiled on first use, cached, loaded with ctypes."""

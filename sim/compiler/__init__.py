"""C code: compiled at first use, cached, loaded with ctypes."""

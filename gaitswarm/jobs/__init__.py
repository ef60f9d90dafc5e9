"""Jobs as commands see them, wherever they are."""

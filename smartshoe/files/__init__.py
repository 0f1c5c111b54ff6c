"""Files of every format, read behind one gate and written whole."""

"""Motion beside the shaft's orders: lines and bands, in all sensors or in one alone."""

"""Classes of missing effect of a carrier: frame, pattern over the sensors, dependence on loads."""

"""What a class of an element is as a measured shape: curve, surface, law that is kept of it."""

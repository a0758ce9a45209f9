"""Columns of the classes of kind element: what each class may add to the force."""

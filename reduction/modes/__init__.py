"""Which modes a basis keeps, how they are found, and what fixes their signs and directions."""

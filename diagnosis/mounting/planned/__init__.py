"""Signatures of the mounting over what is planned and what could be added."""

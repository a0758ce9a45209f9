"""Signatures of the carrier over what is planned and what could be added."""

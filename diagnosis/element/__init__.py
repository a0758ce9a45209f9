"""The kind "element": one mount, damper or spring as a comparison problem."""

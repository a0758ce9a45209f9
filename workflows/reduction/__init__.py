"""Questions about reduced bodies: reduction, certificate, exports."""

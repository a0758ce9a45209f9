"""Motion of the planet carrier identified from rim sensors: models M1 and M2 of the 2012 paper."""

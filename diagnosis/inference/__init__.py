"""Which effects the records support: screening, selection, alias classes, gap reduction, verdict; knows no kind."""

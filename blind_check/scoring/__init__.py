"""How answers are judged and scored."""

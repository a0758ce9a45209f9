"""Where the gap lies: findings beside the gap map, in time, by conditions and between repetitions.

Knows no kind.
"""

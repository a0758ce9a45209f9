"""Table [plan] of a case file: what additions to the campaign cost and what the rig allows."""

from carrierflex.files.toml_values import NotNegative, Number, Positive, TomlTable, key


class PlanTable(TomlTable):
    """What additions cost and what the rig allows; `carrierflex plan` reads it."""

    gap: Positive = key(
        "RMS of a cause's gap over the noise at which causes are to be distinguished", default=6.0
    )
    sensor_cost: NotNegative = key(
        "Cost of one more sensor, in minutes on the rig", "min", default=240.0
    )
    load_case_cost: NotNegative = key(
        "Cost of one more load case in addition to its length, in minutes on the rig",
        "min",
        default=15.0,
    )
    minute_cost: Positive = key("Cost of a minute of record", "min", default=1.0)
    largest_torque: Positive = key("Largest torque of the rig", "N m", default=400e3)
    largest_radial_load: Positive = key(
        "Largest radial load of the rig at the dynamometer coupling", "N", default=200e3
    )
    sensor_angles_deg: list[Number] = key(
        "Housing angles at which a further sensor can be mounted; default: every 30 deg",
        "deg",
        default=[],
    )

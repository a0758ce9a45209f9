"""The commands by name: workflow, table on the screen, help. Nothing of them is imported here."""

from typing import NamedTuple


class Command(NamedTuple):
    """A workflow and how it is shown, by name: nothing of it is imported before it is asked for."""

    workflow: str
    """Module below carrierflex.workflows whose `main` it is."""
    table: str
    """Module below carrierflex.workflows.screen and the function that shows the result."""
    help: str
    """First line of the workflow's docstring."""
    document: str = ""
    """File in the output folder that holds the result, which --json prints."""


# Two lines a command.
# fmt: off
COMMANDS = {
    "run": Command("main_job.run", "job_story:job_story",
        "Run the complete chain for one planet carrier; all results in one folder.",
        "summary.json"),
    "mesh": Command("geometry.mesh_carrier", "tables:quality_table",
        "Mesh the planet carrier with quadratic tetrahedra, its surfaces as named sets."),
    "cad": Command("geometry.write_cad", "tables:cad_table",
        "Write the parametric carrier as carrier.step (unit mm) and surfaces.toml, a template."),
    "cad-faces": Command("geometry.list_cad_faces", "tables:cad_table",
        "List the faces of a STEP file: type, axis, radius, station and area, in metres."),
    "cad-surfaces": Command("geometry.propose_cad_surfaces", "tables:proposal_table",
        "Recognise axis, pins, seats and rim of a STEP file; write surfaces.toml."),
    "curves": Command("fe.compute_curves", "tables:curve_table",
        "Compute the rim's deflection curves by finite elements."),
    "reduce": Command("reduction.reduce_body", "tables:reduced_table",
        "Reduce a body to its pilot nodes and fixed-interface modes (Craig-Bampton)."),
    "join": Command("reduction.join_rotating_group", "tables:joined_table",
        "Join main shaft, carrier and pins to one body, the carrier tilted on the shaft."),
    "study couplings": Command("fe.compare_couplings", "tables:coupling_table",
        "Bracket stiffness and curves between distributing and rigid couplings.", "couplings.json"),
    "study pin-fit": Command("fe.study_pin_fit", "tables:pin_fit_table",
        "Sweep the pin fit from simply supported to rigid.", "pin_fit.json"),
    "study sensitivities": Command("fe.study_sensitivities", "tables:sensitivity_table",
        "Derive curves, matrices and frequencies by dimensions, materials and stiffnesses.",
        "sensitivities.json"),
    "export": Command("reduction.export_body", "tables:export_table",
        "Write a reduced body for another program, or the state space of a body or a case."),
    "certificate": Command("reduction.check_certificate", "tables:certificate_table",
        "Show the reduction certificate of a body; the exit code is 1 where a check fails."),
    "simulate": Command("simulation.simulate_load_case", "simulation_tables:campaign_table",
        "Simulate the sensors in a set of load cases and write them as a campaign folder."),
    "papers table-5": Command("simulation.simulate_table_5", "simulation_tables:table_5_table",
        "Simulate the eight cases of the 2012 paper's table 5 beside a simulated reference.",
        "table_5.json"),
    "papers gap": Command("papers.explain_gap", "simulation_tables:papers_gap_table",
        "Find which unmodelled effect explains tables 4 and 5 of the 2012 paper.",
        "papers_gap.json"),
    "study order-one": Command("simulation.study_order_one", "simulation_tables:order_one_table",
        "Amplitude of order 1 at the axial sensors over the supports of carrier and "
        "housing.", "order_one.json"),
    "study torsion": Command("simulation.compute_torsion", "simulation_tables:torsion_table",
        "Torsional stiffness of main shaft, gearbox and mounting.", "torsion.json"),
    "fmu": Command("simulation.export_fmu", "simulation_tables:fmu_table",
        "Export mounting or stage, nonlinear as they are simulated, as an FMI co-simulation "
        "unit."),
    "study gear-life": Command("simulation.estimate_gear_life", "simulation_tables:gear_life_table",
        "Contact pressure and pitting life of sun and ring mesh over misalignment.",
        "gear_life.json"),
    "cases": Command("simulation.copy_cases", "import_tables:cases_table",
        "List the bundled cases, or copy them; or make a case of a REXS file."),
    "info": Command("describe_file", "import_tables:description_table",
        "Show what a file or folder is, its main figures, and which commands take it."),
    "doctor": Command("check_installation", "import_tables:installation_table",
        "Check the installation and this machine; the exit code is 1 where a requirement fails."),
    "parameters": Command("geometry.write_parameters", "import_tables:parameters_table",
        "Write every dimension with unit, source and limits, and a dimensioned drawing."),
    "new-campaign": Command("identification.new_campaign", "import_tables:map_table",
        "Write a map of a logger's files with guesses: columns, units, clock, angles."),
    "import": Command("identification.import_records", "import_tables:imported_table",
        "Make a campaign folder of a logger's files and the map of their columns.", "import.json"),
    "schema": Command("schemas.show_schema", "import_tables:schema_page",
        "Show the JSON Schema of a kind of file: every key with its words, unit and range."),
    "completion": Command("complete_shell", "import_tables:completion_script",
        "Show the script that completes commands and options in a shell."),
    "plan": Command("diagnosis.plan_campaign", "diagnosis_tables:plan_table",
        "Show which causes a campaign can separate, and the cheapest addition that helps.",
        "plan.json"),
    "check": Command("diagnosis.check_campaign", "diagnosis_tables:check_table",
        "Check a measurement campaign; the exit code is 0 without a finding, 1 with one."),
    "identify": Command("identification.identify_parameters", "tables:estimate_table",
        "Identify the motion of the planet carrier, or the bushings of the "
        "mounting.", "identification.json"),
    "loads": Command("identification.infer_loads", "tables:loads_table",
        "Infer torque, rotor moment and loads of the planet pins from proximity sensors.",
        "loads.json"),
    "diagnose": Command("diagnosis.diagnose_campaign", "diagnosis_tables:diagnosis_table",
        "Diagnose the gap between a measurement campaign and its baseline "
        "simulation.", "diagnosis.json"),
    "calibrate": Command("diagnosis.calibrate_campaign", "diagnosis_tables:calibration_table",
        "Add the causes that a diagnosis names to the simulation, diagnose again, compare.",
        "calibration.json"),
    "compare": Command("diagnosis.compare_diagnoses", "diagnosis_tables:comparison_table",
        "Compare two diagnoses: before and after the simulator changed, or of two turbines or "
        "days.", "comparison.json"),
    "batch": Command("fleet.diagnose_fleet", "diagnosis_tables:fleet_table",
        "Diagnose all campaigns below a folder, and compare turbines and days.", "fleet.json"),
    "watch": Command("fleet.watch_turbine", "diagnosis_tables:watch_table",
        "Watch the running records of a turbine for a new cause or a change of size.",
        "watch.json"),
    "report": Command("diagnosis.write_report", "diagnosis_tables:report_line",
        "Write the report page of a diagnosis again, without a new fit."),
    "app": Command("app.serve_app", "import_tables:closed_page_line",
        "Open a page in the browser of this machine: from logger files to the report."),
    "view": Command("view3d.view_file", "tables:view_table",
        "Write an interactive 3-D page of a body, deflection curves or the gap at the rim."),
    "blind-check": Command("diagnosis.run_blind_check", "diagnosis_tables:blind_check_table",
        "Diagnose sealed campaigns and score the answers.", "blind_check.json"),
    "figures": Command("figures.draw_figures", "simulation_tables:figures_table",
        "Draw the figures of the papers of 2011 and 2012 by their numbers, with an index.",
        "figures.json"),
    "papers printed-tables": Command(
        "identification.read_printed_tables", "tables:printed_tables_table",
        "Derive rim deflection, phi_PLC and static saddle from tables 4 and 5 of 2012.",
        "printed_tables.json"),
}

#: What the first help shows, by what it is for; at most 28 names fit on one screen.
GROUPS = {
    "Start": ("run", "cases", "parameters", "info", "doctor", "app"),
    "Model": ("cad", "mesh", "curves", "reduce", "certificate", "export"),
    "Simulate": ("simulate", "study"),
    "Measure": ("plan", "new-campaign", "import", "check", "identify", "loads"),
    "Diagnose": ("diagnose", "report", "calibrate", "compare"),
    "Fleet": ("batch", "watch"),
    "Show": ("view", "papers"),
}

#: Names that hold commands: the first word of "study torsion".
HOLDERS = {
    "study": "Study one question of the carrier or its stage over a range of inputs.",
    "papers": "Compute what the papers of 2011 and 2012 print.",
}

#: Commands that the first help leaves out, by the command whose help shows them.
RELATED = {
    "cad": ("cad-faces", "cad-surfaces"),
    "reduce": ("join",),
    "simulate": ("fmu",),
    "diagnose": ("blind-check",),
    "info": ("schema",),
    "doctor": ("completion",),
    "papers": ("figures",),
}

#: New names of commands and options; refusals of the old ones show them.
RENAMED = {
    "couplings": "study couplings",
    "pin-fit": "study pin-fit",
    "sensitivities": "study sensitivities",
    "order-one": "study order-one",
    "torsion": "study torsion",
    "gear-life": "study gear-life",
    "table-5": "papers table-5",
    "printed-tables": "papers printed-tables",
    "export-fmu": "fmu",
    "--element-size": "--size",
    "--study-sizes": "--mesh-sizes",
    "--mounting": "--case",
    "--max-frequency": "--modes-below",
    "--frf-up-to": "--up-to",
    "--export": "--sealed-campaigns",
    "--cases": "--only",
}


def command_in(words: list[str]) -> str | None:
    """Name of the command that a line begins with; None where there is none of that name."""
    name = " ".join(words[: 2 if words[:1] and words[0] in HOLDERS else 1])
    return name if name in COMMANDS else None

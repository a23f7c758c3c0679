"""What pytest leaves alone, where it finds its files, and which group each test belongs to.

Whatever folder it is called from, a test belongs to one group, chosen by its file, so that ``pytest -m fast`` is the
inner loop:

fast      textbook, control, simulation, checks of exercises, rooms: a minute together
long      of the same rooms, what takes half a second and more: many draws, many lost runs, films
slow      engine, studies, figures, explorers, types, the way of a new lesson
notebook  cells and stored outputs of the lessons
oracle    peer engines and symbolic derivations
browser   a real JupyterLab
"""

import re
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
LEFT_ALONE = {
    HERE / name
    for name in (
        "conftest.py", "docs", "notebooks/build.py", "notebooks/skeleton", "notebooks/solutions", "notebooks/workshop",
        "tests/bench", "tests/browser/conftest.py", "tests/site.py", "tests/user_script.py",
    )
}  # fmt: skip
GROUPS = {
    "long": [
        "test_causes",
        "test_properties_of_gains",
        "test_properties_of_runs",
        "test_published",
        "test_self_calibration",
        "test_statements",
        "test_using_redundancy",
    ],
    "slow": [
        "test_answers",
        "test_bench",
        "test_colab",
        "test_colours",
        "test_compiled_law",
        "test_docs",
        "test_engine",
        "test_engine_js",
        "test_explore",
        "test_figures",
        "test_hostile",
        "test_locked_down",
        "test_grader",
        "test_lanes",
        "test_long_runs",
        "test_nbgrader",
        "test_numbers_of_explorers",
        "test_numbers_of_figures",
        "test_package",
        "test_reach",
        "test_skeleton",
        "test_stage_js",
        "test_sweep",
        "test_teaching",
        "test_types",
    ],
    "oracle": ["test_oracles", "test_symbolic", "test_your_machine"],
    "browser": ["test_lab", "test_lite", "test_stage", "test_start"],
}
# Longer than their file lets one expect.
LONG = {
    "test_a_filter_multiplies_the_torques_of_switching_by_r_at_its_own_pose",
    "test_a_formula_of_a_users_is_asked_or_refused",
    "test_a_law_of_the_package_in_a_loop_of_your_own",
    "test_a_noisy_log_of_few_places_is_refused_with_what_it_says",
    "test_a_pose_far_from_all_readings_is_the_same_in_both_loops",
    "test_a_run_ends_at_the_sample_at_which_its_textbook_law_does",
    "test_a_sweep_knows_why_each_row_is_masked",
    "test_base_angles_of_a_pose_go_on_where_a_path_turns_on",
    "test_blank_answers_are_not_yet",
    "test_changed_values_of_a_users_class_stay_of_that_class",
    "test_common_sign_of_any_mechanism",
    "test_covariance_is_that_of_a_hundred_repetitions",
    "test_filter_finds_the_pose_of_drives_that_are_turns_behind",
    "test_force_left_is_where_a_linear_programme_ends",
    "test_integral_behind_the_filter_takes_up_the_leak",
    "test_intervals_from_few_poses_cover_what_they_say",
    "test_intervals_from_torques_know_that_encoders_count",
    "test_laws_of_the_package_meet_the_same_faults",
    "test_lyapunov_function_falls_at_the_rate_of_the_damping",
    "test_numerics_of_the_pseudoinverse",
    "test_offsets_far_from_zero_are_found_or_refused",
    "test_rates_of_complement_and_projector_against_finite_differences",
    "test_rests_with_counts_are_no_rests_and_no_better_than_their_rounding",
    "test_rounded_times_are_the_multiples_of_their_step",
    "test_rule_of_section_4_5_is_the_wrong_way_round",
    "test_runs_below_the_threshold_come_to_rest",
    "test_runs_without_a_place_of_rest_keep_moving",
    "test_share_of_random_machines_with_a_common_sign",
    "test_share_of_the_workspace_without_backlash",
    "test_switching_takes_the_best_pair_and_hysteresis_saves_switches",
    "test_three_best_places",
    "test_under_the_filter_torques_are_mute_and_angles_are_not",
    "test_work_of_drives_that_fall_turns_behind_is_the_energy_of_the_machine",
    "test_wrong_answers_fail_without_a_hint",
}
NOTEBOOK = {"test_solved_lesson_passes_every_check_in_strict_mode"}
_GROUP = {stem: group for group, stems in GROUPS.items() for stem in stems}
NAMES = {"fast", "long", "notebook", *GROUPS}


def left_out(path, expression: str) -> bool:
    """Is no test of this file in the groups that the expression after ``-m`` asks for? Then it need not be read."""
    words = set(re.findall(r"\w+", expression)) - {"or"}
    if path.suffix not in (".py", ".ipynb") or not words or words - NAMES:
        return False
    own = "notebook" if path.suffix == ".ipynb" else _GROUP.get(path.stem, "fast")
    # By their names, some tests of these files are in another group.
    return not words & ({own, "long", "notebook"} if own in ("fast", "slow") else {own})


def group(item) -> str:
    """The group of a collected test."""
    name = getattr(item, "originalname", item.name)
    if item.path.suffix == ".ipynb" or name in NOTEBOOK:
        return "notebook"
    if name in LONG or name.rpartition(".")[2].startswith("film"):
        return "long"
    return _GROUP.get(item.path.stem, "fast")


def pytest_ignore_collect(collection_path, config):
    return True if collection_path in LEFT_ALONE or left_out(collection_path, config.option.markexpr) else None


def pytest_collection_modifyitems(items):
    for item in items:
        item.add_marker(getattr(pytest.mark, group(item)))


@pytest.fixture(autouse=True)
def no_figure_stays_open():
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")


def pytest_configure(config):
    config.option.nbval_sanitize_with = str(HERE / "tests" / "nbval-sanitize.cfg")

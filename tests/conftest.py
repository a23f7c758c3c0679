"""Where each test belongs: one group per test, chosen by its file, so that ``pytest -m fast`` is the inner loop.

fast      textbook, control, simulation, checks of exercises, rooms: a minute or two together
long      of the same rooms, seconds each: many draws, many lost runs
slow      engine, studies, figures, explorers, types, the way of a new lesson
notebook  cells and stored outputs of the lessons
oracle    peer engines and symbolic derivations
browser   a real JupyterLab
"""

from pathlib import Path

import pytest

GROUPS = {
    "long": ["test_causes", "test_self_calibration"],
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
    "test_a_corner_of_the_force_polygon_is_reached_exactly",
    "test_a_filter_multiplies_the_torques_of_switching_by_r_at_its_own_pose",
    "test_a_pose_far_from_all_readings_is_the_same_in_both_loops",
    "test_a_run_ends_at_the_sample_at_which_its_textbook_law_does",
    "test_blank_answers_are_not_yet",
    "test_covariance_is_that_of_a_hundred_repetitions",
    "test_every_pair_stays_inside_the_polygon_of_all",
    "test_filter_finds_the_pose_of_drives_that_are_turns_behind",
    "test_integral_behind_the_filter_takes_up_the_leak",
    "test_intervals_from_few_poses_cover_what_they_say",
    "test_lyapunov_function_falls_at_the_rate_of_the_damping",
    "test_offsets_far_from_zero_are_found_or_refused",
    "test_rests_with_counts_are_no_rests_and_no_better_than_their_rounding",
    "test_rounded_times_are_the_multiples_of_their_step",
    "test_runs_below_the_threshold_come_to_rest",
    "test_runs_without_a_place_of_rest_keep_moving",
    "test_share_of_random_machines_with_a_common_sign",
    "test_switching_takes_the_best_pair_and_hysteresis_saves_switches",
    "test_three_best_places",
    "test_wrong_answers_fail_without_a_hint",
}
NOTEBOOK = {"test_solved_lesson_passes_every_check_in_strict_mode"}
_GROUP = {stem: group for group, stems in GROUPS.items() for stem in stems}


def group(item) -> str:
    """The group of a collected test."""
    if item.path.suffix == ".ipynb" or getattr(item, "originalname", "") in NOTEBOOK:
        return "notebook"
    if getattr(item, "originalname", "") in LONG:
        return "long"
    return _GROUP.get(Path(item.path).stem, "fast")


def pytest_collection_modifyitems(items):
    for item in items:
        item.add_marker(getattr(pytest.mark, group(item)))

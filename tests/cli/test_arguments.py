from touchdown.cli import arguments
from touchdown.runs import folder
from touchdown.studies import store


def test_the_command_line_has_the_default_folders_of_the_functions():
    assert arguments.DEFAULT_RUNS == folder.DEFAULT_RUNS
    assert arguments.DEFAULT_RESULTS == store.DEFAULT_RESULTS

"""The study verbs as functions, for notebooks and scripts."""

from touchdown.api.studies.agent_search import TunedAgent, tune_agent
from touchdown.api.studies.check import check_statistics
from touchdown.api.studies.comparison import compare
from touchdown.api.studies.find import StudySelection, find_study
from touchdown.api.studies.listing import TopicListing, list_studies
from touchdown.api.studies.report import study_report
from touchdown.api.studies.run import estimate_study, executor_of, run_study
from touchdown.api.studies.sharing import Imported, export_results, import_results
from touchdown.api.studies.status import StudyProgress, study_status

__all__ = [
    "Imported",
    "StudyProgress",
    "StudySelection",
    "TopicListing",
    "TunedAgent",
    "check_statistics",
    "compare",
    "estimate_study",
    "executor_of",
    "export_results",
    "find_study",
    "import_results",
    "list_studies",
    "run_study",
    "study_report",
    "study_status",
    "tune_agent",
]

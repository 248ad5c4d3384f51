from matplotlib.figure import Figure
from PIL import Image

from touchdown.figures import importance

SHARES = {"learning.gamma": 0.2, "learning.learning_rate": 0.7, "replay.resaves": 0.1}


def test_the_most_important_setting_is_at_the_top():
    ax = importance.draw_importance(Figure().subplots(), SHARES)
    names = [text.get_text() for text in ax.get_yticklabels()]
    assert names == ["replay.resaves", "learning.gamma", "learning.learning_rate"]
    assert [text.get_text() for text in ax.texts] == ["10%", "20%", "70%"]


def test_importance_is_written_as_a_picture(tmp_path):
    path = tmp_path / "importance.png"
    importance.save_importance(path, SHARES)
    with Image.open(path) as picture:
        assert picture.format == "PNG"
        assert picture.width > picture.height

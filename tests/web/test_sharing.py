from javascript import in_node


def test_a_cancelled_dialog_copies_no_link_and_a_forbidden_one_does():
    cancelled, forbidden = in_node("sharing.js", "share", ["AbortError", "NotAllowedError"])
    assert cancelled == {"said": "Not shared.", "copied": []}
    assert forbidden == {"said": "The link to this flight is copied.", "copied": ["link"]}

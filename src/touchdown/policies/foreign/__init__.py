"""Policies of other libraries; reading their files runs no code in them."""

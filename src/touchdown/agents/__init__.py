"""What the agent learns."""

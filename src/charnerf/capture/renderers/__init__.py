"""What reads a character's file and takes its pictures."""

"""`maya fleet`: supervise several robots over an MQTT broker."""

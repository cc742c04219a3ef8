"""What a device is: its protocol, and what all devices share."""

"""The state of one vehicle: values and records that messages change."""

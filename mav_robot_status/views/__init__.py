"""Views for people: a report of a flight, a live table. They use the values of `interface`, not MAVLink."""

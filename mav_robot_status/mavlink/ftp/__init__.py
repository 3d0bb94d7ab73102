"""MAVLink FTP: reads files of a vehicle, without I/O. The protocol: https://mavlink.io/en/services/ftp.html."""

"""Publishers, one module each. The entry points `mav_robot_status.publishers` register them."""

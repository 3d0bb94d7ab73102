"""Guards around the parts of third parties: hardware interfaces, controllers, publishers."""

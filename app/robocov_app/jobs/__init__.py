"""Background work in separate processes.

A *service* is a class that is built without arguments and answers requests; see `messages.Service`.

- `workers`: runs a service for a window that must not block; only the newest request counts
- `processes`: starts the process of a service, for callers that wait for each answer
- `serving`: main loop inside the process of a service
- `messages`: messages between a program and its services
"""

"""Work in processes of their own.

A *service* is a class without arguments whose objects answer questions, see `messages.Service`.

- `workers`: a service for a window that must not wait; only the newest question counts
- `processes`: a service in a process, for callers that wait
- `serving`: the other side, in the process of the service
- `messages`: the messages between the two
"""

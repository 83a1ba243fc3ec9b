"""The service: every edge calls the methods of `api.service.Service` and shows the types of `schema`."""

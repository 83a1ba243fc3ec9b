"""The service: every edge calls the methods of `service.service.Service` and shows the types of `schema`."""

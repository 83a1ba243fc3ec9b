"""The service: every interface calls the methods of `service.service.Service` and sends the types of `schema`."""

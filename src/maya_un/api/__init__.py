"""The one door: every edge calls the methods of `api.service.Service` and shows the types of `maya_un.schema`."""

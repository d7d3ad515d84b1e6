// Under sanitizers libraries stay loaded: what a driver does that is no longer there has no name, so that no
// suppression could say whose it is.
extern "C" int dlclose(void*) { return 0; }

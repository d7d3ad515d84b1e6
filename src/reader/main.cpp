// brume_reader: decodes image files for brume in a process of its own (frame/decode.hpp). Not for people.
#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <iostream>

#include "frame/reader_process.hpp"

int main() {
    const int line = 3;
    int type = 0;
    socklen_t size = sizeof type;
    if (getsockopt(line, SOL_SOCKET, SO_TYPE, &type, &size) != 0) {
        std::cerr << "brume_reader: brume starts this by itself, to decode image files\n";
        return 2;
    }
    fcntl(line, F_SETFD, FD_CLOEXEC);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    // What a library says as it goes down is brume's to say, in its own words.
    if (const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC); nowhere >= 0)
        dup2(nowhere, STDERR_FILENO);
#endif
    brume::serveDecoding(line);
    _exit(0);  // nothing is left to be put in order
}

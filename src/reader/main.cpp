// brume_reader: decodes image files for brume in a process of its own (frame/decode.hpp). Not for people.
#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <iostream>

#include "frame/reader_line.hpp"
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
    // What a library says as it goes down is brume's to say, in its own words.
    if (const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC); nowhere >= 0 && !brume::isSanitized)
        dup2(nowhere, STDERR_FILENO);
    brume::serveDecoding(line);
    _exit(0);  // nothing is left to be put in order
}

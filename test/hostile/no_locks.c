/* Loaded before a program: a file system that refuses to lock files, as NFS and Lustre may (ENOLCK). */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>

int flock(int descriptor, int operation)
{
   (void)descriptor;
   (void)operation;
   errno = ENOLCK;
   return -1;
}

#define REFUSING(name) \
   int name(int descriptor, int command, ...) \
   { \
      va_list more; \
      va_start(more, command); \
      void *argument = va_arg(more, void *); \
      va_end(more); \
      if (command == F_SETLK || command == F_SETLKW || command == F_OFD_SETLK || command == F_OFD_SETLKW) { \
         errno = ENOLCK; \
         return -1; \
      } \
      return ((int (*)(int, int, void *))dlsym(RTLD_NEXT, #name))(descriptor, command, argument); \
   }

REFUSING(fcntl)
REFUSING(fcntl64)

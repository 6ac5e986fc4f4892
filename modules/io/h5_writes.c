/* SPDX-License-Identifier: MIT
 * What HDF5 writes passes here on its way to MPI-IO, through MPI's profiling interface.
 *
 * HDF5 does not survive a write that fails: it crashes when the file is closed, or its ranks wait
 * for each other for ever. So it is told that all went well; the program asks for the first failure
 * after each call (h5_file), closes the file in good order, and removes it. */
#include <errno.h>
#include <mpi.h>

static int lost = 0; /* errno of the first failure in the present file; -1: MPI's own; 0: none */

void stirpoint_begin_writes(void) { lost = 0; }

int stirpoint_lost_write(void) { return lost; }

static int note(int code)
{
    if (code != MPI_SUCCESS && lost == 0) lost = errno > 0 ? errno : -1;
    return MPI_SUCCESS;
}

/* Each rank on its own, also where HDF5 asks for all together: Open MPI's collective write says
 * nothing of a full disk, and the pieces of the ranks are large. */
int MPI_File_write_at(MPI_File file, MPI_Offset offset, const void *data, int count, MPI_Datatype type,
                      MPI_Status *status)
{
    MPI_Status own;
    MPI_Count done = 0;
    int bytes;

    MPI_Type_size(type, &bytes);
    if (lost == 0 && count > 0 && bytes > 0) {
        errno = 0;
        note(PMPI_File_write_at(file, offset, data, count, type, &own));
        if (lost == 0) MPI_Get_elements_x(&own, MPI_BYTE, &done);
        if (lost == 0 && done < (MPI_Count)count * bytes) lost = ENOSPC;
    }
    if (status != MPI_STATUS_IGNORE) MPI_Status_set_elements_x(status, MPI_BYTE, (MPI_Count)count * bytes);
    return MPI_SUCCESS;
}

int MPI_File_write_at_all(MPI_File file, MPI_Offset offset, const void *data, int count, MPI_Datatype type,
                          MPI_Status *status)
{
    return MPI_File_write_at(file, offset, data, count, type, status);
}

int MPI_File_set_size(MPI_File file, MPI_Offset size)
{
    errno = 0;
    return note(PMPI_File_set_size(file, size));
}

int MPI_File_sync(MPI_File file)
{
    errno = 0;
    return note(PMPI_File_sync(file));
}

int MPI_File_close(MPI_File *file)
{
    errno = 0;
    return note(PMPI_File_close(file));
}

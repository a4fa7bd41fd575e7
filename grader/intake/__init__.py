"""A folder, an archive or a git URL becomes a folder on disk with the lab's package in it; nothing is run.

SOURCE as it stands on the command line comes in, `model.submission.Submission` goes out. Everything hostile about a
source is dealt with here: its size, its names, its links, its git settings. Reading the files is the job of
`package/`.
"""

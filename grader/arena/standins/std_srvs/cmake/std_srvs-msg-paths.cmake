set(std_srvs_MSG_INCLUDE_DIRS "")
set(std_srvs_MSG_DEPENDENCIES "")

#!/usr/bin/env python3
"""Keeps a value between two bounds."""

import rospy
from own_service.srv import Clamp, ClampResponse


def clamp(request):
    if request.low > request.high:
        raise rospy.ServiceException('low is above high')
    result = min(max(request.value, request.low), request.high)
    return ClampResponse(result=result, changed=result != request.value)


if __name__ == '__main__':
    rospy.init_node('clamp_server')
    rospy.Service('/clamp', Clamp, clamp)
    rospy.spin()

#!/usr/bin/env python
"""Reads the details on the parameter server and changes the phone number."""

import rospy


def main():
    rospy.init_node('node_param_get_set', anonymous=True)
    rospy.loginfo('Reading from Parameter Server.')

    details = rospy.get_param('details')
    first = details['name']['first']
    last = details['name']['last']
    address = details['contact']['address']
    phone = details['contact']['phone']

    rospy.loginfo('>> First Name: {}'.format(first))
    rospy.loginfo('>> Last Name: {}'.format(last))
    rospy.loginfo('>> Address: {}'.format(address))
    rospy.loginfo('>> Phone: {}'.format(phone))

    rospy.set_param('/details/contact/phone', 55555)
    new_phone = rospy.get_param('/details/contact/phone')
    rospy.loginfo('>> New Phone: {}'.format(new_phone))


if __name__ == '__main__':
    try:
        main()
    except rospy.ROSInterruptException:
        pass

from standin_messages import define

define(globals())

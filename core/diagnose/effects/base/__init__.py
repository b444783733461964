"""The interface of an effect and the parts that several effects share."""
